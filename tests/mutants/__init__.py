"""Mutation testing: random single changes of the package, each against the tests that can notice it.

python -m tests.mutants --sample 200 --seed 1 --results out/mutants.json
"""
