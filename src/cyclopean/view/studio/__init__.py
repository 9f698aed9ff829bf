"""The live page: a model in the browser with sliders, whose verdict follows."""
