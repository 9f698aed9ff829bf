"""Analysis of a model that grew out of one whose verdict is known: seat what is new, then step to a state inside."""
