"""The compiled model at work: functions on arrays, simulation, solutions and their files."""
