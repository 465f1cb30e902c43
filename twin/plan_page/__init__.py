"""The plan of a run on one page that is printed and signed: PDF, picture or HTML."""
