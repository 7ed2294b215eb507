# Needs Python 3.11+, pip and make.
# make setup | demo | test | compiled | docs | commands | simulate | landings | fuzz | check | bench | wheels | clean
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
PIP    := $(BIN)/python -m pip --quiet --disable-pip-version-check

.PHONY: setup demo test compiled docs commands simulate landings fuzz check bench wheels format clean

setup: $(STAMP)

$(STAMP): pyproject.toml requirements.lock
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --require-hashes --requirement requirements.lock
	$(PIP) install --no-deps --no-build-isolation --editable .
	$(BIN)/python -m pip check
	touch $@

demo: $(STAMP)
	$(BIN)/onboard demo $(ARGS)

# A process for each core and one more, for services, browsers and brokers are waited for; a file of
# tests in one of them; ARGS="-n 0" runs all in one.  The matrices are small: threads of the linear
# algebra would only be in each other's way.  Without compiled tests on disk, each process would
# spend seconds on compiling them anew.
WORKERS ?= $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)

test: $(STAMP)
	PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(WORKERS) --dist loadfile $(ARGS)

# The loops that numba compiles, once: else each process of the first tests spends half a minute on
# the same.
compiled: $(STAMP)
	$(BIN)/python -c "import onboard.core.filter.compiled, onboard.core.maths.loops"

# Pushes under faults: 100,000 histories, each from its seed; ARGS="--seed 7" plays that one alone.
simulate: $(STAMP)
	$(BIN)/python -m benchmarks.pushes $(ARGS)

landings: $(STAMP)
	$(BIN)/python -m benchmarks.landings $(ARGS)

# Ten minutes; ARGS="--seconds 3600 --seed 2 --only ulog http" for others.
fuzz: $(STAMP)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.fuzz $(ARGS)

# The manuals and the API's reference as one searchable site in build/site, by tools of its own.
SITE      := .venv-site
SITESTAMP := $(SITE)/.installed

$(SITESTAMP): docs/site/requirements.lock
	test -x $(SITE)/bin/python || $(PYTHON) -m venv $(SITE)
	$(SITE)/bin/python -m pip --quiet --disable-pip-version-check install --require-hashes --requirement $<
	touch $@

docs: $(SITESTAMP)
	NO_MKDOCS_2_WARNING=1 $(SITE)/bin/mkdocs build --strict $(ARGS)

# docs/commands.md, the man page and the completions, from what the commands say of themselves.
commands: $(STAMP)
	$(BIN)/python deploy/commands.py

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	# What tests import is there: seconds, not the whole of them, and what is compiled for it is kept.
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --collect-only -qq

bench: $(STAMP)
	$(BIN)/python -m benchmarks $(ARGS)

# A folder to carry to a computer without network (systemd/README.md); for one of another kind
# ARGS="--platform manylinux_2_28_aarch64 --platform manylinux2014_aarch64 --python-version 3.11".
wheels: $(STAMP)
	rm -rf dist/wheels
	$(BIN)/python -m hatchling build -t wheel -d dist/wheels
	$(PIP) download --require-hashes --only-binary :all: -r requirements-service.lock -d dist/wheels $(ARGS)
	cp requirements-service.lock dist/wheels

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) $(SITE) build .pytest_cache .mypy_cache .ruff_cache .hypothesis
