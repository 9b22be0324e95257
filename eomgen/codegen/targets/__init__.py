"""Target languages, one room each: names, printer, files."""
