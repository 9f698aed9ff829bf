"""The components, one file for each kind of question. Pure functions: inputs in, values out; none reads or prints."""
