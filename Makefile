# make demo   runs the main jobs: the spin-up beam and the active vehicle, from scene file to figure
# make acados unpacks acados below .venv, for its tests, its example and benchmarks.optimisers
# make test   passes the tests: one witness of each kind; make test-all runs the others
# make test-long runs the tests of minutes, more than an hour: before a release; make test-long TENTH=3 runs a tenth of them
# make coverage shows which lines the first tier runs, 90 % of them or more
# make mutants tries thirty random changes of the package against the first tier: python -m tests.mutants --help says more
# make docs   builds the documentation site, docs/_build/html, without network; a warning is an error
# make bench  runs eomgen beside its peers, which it installs below .bench, and writes docs/benchmarks.md: a quarter of an hour
# make peers  compares eomgen with eight other programs on random scenes, and writes docs/peers.md: ten minutes
# The others make their own virtual environment in .venv and install what they need.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# One installation for each target: every one of them resolves and builds anew. Python compiles the modules that it
# imports; to compile all of them would be most of the work of an installation.
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
INSTALL = $(PIP) --editable
# An environment or package index set by the user is respected; nothing here names one.

# Tests start Python hundreds of times, which takes 0.4 s more each if nobody keeps compiled modules.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo live acados test test-all test-long coverage browser lint types golden mutants docs bench peers clean

$(VENV)/made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "eomgen needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version). Try: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { echo "could not make a virtual environment. On Debian or Ubuntu try: apt-get install python3-venv" >&2; exit 1; }
	@touch $@

$(VENV)/installed: $(VENV)/made pyproject.toml
	$(INSTALL) .
	@touch $@

$(VENV)/installed-test: $(VENV)/made pyproject.toml
	$(INSTALL) '.[test,dev]'
	@touch $@ $(VENV)/installed

$(VENV)/installed-all: $(VENV)/made pyproject.toml
	$(INSTALL) '.[test,dev,notebook,compiler,docs,gpu]'
	@touch $@ $(VENV)/installed-test $(VENV)/installed-docs $(VENV)/installed

$(VENV)/installed-docs: $(VENV)/made pyproject.toml
	$(INSTALL) '.[docs]'
	@touch $@ $(VENV)/installed

demo: $(VENV)/installed
	$(BIN)/eomgen doctor --quiet
	$(BIN)/python examples/spin_up_beam/demo.py --out out/spin_up_beam
	@echo
	$(BIN)/python examples/active_vehicle/demo.py --out out/active_vehicle
	@echo
	@echo "Open out/active_vehicle/active_vehicle.png: a car on a rough road, without and with its active suspension."

# The wheel has a CasADi of its own, so it is unpacked apart, in the shape of an installation from source.
ACADOS := $(VENV)/acados
acados: $(VENV)/made
	@test -e $(ACADOS)/interfaces || { \
	  $(PIP) --no-deps --target $(ACADOS)/wheel comma-deps-acados && \
	  for part in bin lib include; do ln -sfn wheel/acados/install/$$part $(ACADOS)/$$part; done && \
	  mkdir -p $(ACADOS)/interfaces/acados_template && \
	  ln -sfn ../../wheel/acados/acados_template $(ACADOS)/interfaces/acados_template/acados_template; } || \
	  echo "no wheel of acados for this machine: tests of acados are skipped" >&2

# Tests that look at pages need Chromium: it is installed where apt-get and the right to use it are there.
browser: $(VENV)/installed-test
	@$(BIN)/python -c 'import sys; from tests.browser.chromium import chromium; sys.exit(chromium() is None)' || \
	  { command -v apt-get >/dev/null && test "$$(id -u)" = 0 && apt-get update -qq && \
	    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null; } || \
	  echo "no Chromium: the tests in tests/browser will fail. Install Chromium or Chrome, or name it: CHROMIUM=<path> make test" >&2

test: $(VENV)/installed-test browser acados
	$(BIN)/eomgen doctor --quiet
	$(BIN)/python -m pytest -n auto -m "not slow"

test-all: $(VENV)/installed-all browser acados
	$(BIN)/python -m pytest -n auto -m "slow and not long"

# PyTorch brings gigabytes of libraries of graphics cards on Linux: its tests are in tenth 0, which alone installs it.
test-long: $(VENV)/installed-all browser
	$(if $(filter-out 0,$(TENTH)),,$(INSTALL) '.[torch]')
	$(BIN)/python -m pytest -n auto -m long $(if $(TENTH),--part $(TENTH)/10)

coverage: $(VENV)/installed-test browser
	$(BIN)/python -m pytest -n auto -m "not slow" --cov=eomgen --cov-report=term --cov-fail-under=90

lint: $(VENV)/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/python -m tests.docstrings
	$(BIN)/python -m tests.prose
	$(BIN)/codespell

types: $(VENV)/installed-test
	$(BIN)/mypy
	$(BIN)/python -m tests.users_scripts

# Live pages of the examples that docs/live.md lists.
live: $(VENV)/installed
	@for scene in four_bar/scene bouncing_ball/scene active_vehicle/scene elastic_slider_crank/scene spin_up_beam/exact \
	    pi_servo/sampled heavy_top/joint_coordinates double_pendulum_on_shaking_base/scene; do \
	    $(BIN)/eomgen live examples/$$scene.toml --out out/live/$$(dirname $$scene).html || exit; \
	done
	@cd out/live && for page in [!i]*.html; do echo "<p><a href='$$page'>$${page%.html}</a></p>"; done >index.html

golden: $(VENV)/installed-test
	$(BIN)/python -m tests.golden --update

mutants: $(VENV)/installed-test
	$(BIN)/python -m tests.mutants --sample 30

docs: $(VENV)/installed-docs
	$(BIN)/python -m docs.site

# One environment for each group of peers that agree; a peer that does not install is a row that says so.
bench:
	$(PYTHON) -m benchmarks.suite.environments
	.bench/eomgen/bin/python -m benchmarks.suite
	.bench/eomgen/bin/python -m benchmarks.suite.page
	.bench/eomgen/bin/python -m benchmarks.suite.history
	.bench/eomgen/bin/python -m benchmarks.suite.figures

# Siconos has no wheel: it is installed where apt-get and the right to use it are there.
peers:
	@dpkg-query --show python3-siconos >/dev/null 2>&1 || \
	  { command -v apt-get >/dev/null && test "$$(id -u)" = 0 && apt-get update -qq && \
	    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends python3-siconos >/dev/null; } || \
	  echo "no Siconos: its row will say so" >&2
	$(PYTHON) -m benchmarks.suite.environments peers
	.bench/peers/bin/python -m tests.peers docs/peers.md

clean:
	rm -rf $(VENV) .bench out docs/_build
