"""What runs and analyses leave: solutions, dense output, plots, tables, animations."""
