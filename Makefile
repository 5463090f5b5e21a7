# Two commands:  make run   the McPherson strut in every engine, compared and reported
#                make test  style, types and tests
# make board builds the short board of time steppers into board/.
# make docs builds the documentation into site/, and make film writes its film again.
# Plain Python with venv is enough; uv is used when it is there.
PYTHON ?= python3
BIN := .venv/bin
UV := $(shell command -v uv 2>/dev/null)

.PHONY: run test types tests board nightly docs film lock sizes house mutants fuzz clean

run: .venv/ready
	$(BIN)/kincheck run mcpherson_strut --out report

# One process checks the types, beside the tests.
test: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(MAKE) --jobs 2 types tests

types: .venv/ready
	$(BIN)/pyright --pythonpath $(BIN)/python

tests: .venv/ready
	$(BIN)/pytest --numprocesses auto --dist worksteal

# Three closed loops in four engines: half a minute. An engine that is not installed is named.
board: .venv/ready
	$(BIN)/kincheck board --case bricard bennett planar_slider_crank --engine mujoco pinocchio exudyn drake --steps 200 --out board

# The dear tests, which the nightly workflow runs, and new examples for those that draw them.
nightly: .venv/ready
	$(BIN)/pytest -m nightly --numprocesses auto --dist worksteal
	$(BIN)/pytest -m hypothesis --hypothesis-profile=search --numprocesses auto --dist worksteal

# Pages, figures and reference pages; a warning is an error.
docs: .venv/docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict --config-file docs/mkdocs.yml

# The tour of the README and of the front page, after a change of the pages it shows: a minute. It needs Chromium.
film: .venv/ready
	$(BIN)/python -m docs.film

.venv/docs: .venv/ready
ifdef UV
	uv pip install --quiet --python $(BIN)/python --config-settings editable_mode=strict --editable '.[docs]'
else
	$(BIN)/python -m pip install --quiet --config-settings editable_mode=strict --editable '.[docs]'
endif
	touch $@

# Type checkers see an editable installation only if it is strict: a folder of links, build/, which
# is made again when a file comes or goes.
EDITABLE := --no-deps --config-settings editable_mode=strict --editable .
FILES := $(shell find core adapters cases -type f ! -name '*.py[co]' | sort | cksum | tr -d ' ')

.venv/files-$(FILES):
	mkdir -p .venv
	rm -rf .venv/files-* build
	touch $@

.venv/ready: pyproject.toml requirements.lock core/version.py .venv/files-$(FILES)
ifdef UV
	uv venv --quiet --allow-existing --python $(PYTHON) .venv
	uv pip install --quiet --compile-bytecode --python $(BIN)/python --requirement requirements.lock
	uv pip install --quiet --python $(BIN)/python $(EDITABLE)
else
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --requirement requirements.lock
	$(BIN)/python -m pip install --quiet $(EDITABLE)
endif
	# what is installed as editable is not compiled, and where Python may not write bytecode every process would do it again
	$(BIN)/python -m compileall -q build
	touch $@

# Pin the newest versions that pyproject.toml allows: for developers, for those who only run kincheck (Containerfile), and for the
# release.
LOCK := uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --upgrade
lock: .venv/ready
	$(LOCK) --extra dev pyproject.toml --output-file requirements.lock
	$(LOCK) --extra engines --extra fast --extra proofs --extra yaml --extra parquet --constraint requirements.lock \
		pyproject.toml --output-file requirements-runtime.lock
	$(LOCK) --constraint requirements.lock --group release --output-file requirements-release.lock

# What an installation without extras and with some takes on the disk [MB], for docs/pages/start/install.md.
sizes:
	for extras in '' '[engines]' '[all]' '[all-engines]'; do \
		folder=$$(mktemp -d) && $(PYTHON) -m venv $$folder && $$folder/bin/python -m pip install --quiet ".$$extras" \
		&& echo "kincheck$$extras $$(du -sm $$folder | cut -f1) MB"; rm -rf $$folder; done

# Tokens, files and functions of each room, against the budgets in tests/house.toml.
house: .venv/ready
	$(BIN)/python -m tests.house

# Share of small mistakes that the tests find, by room: make mutants N=200 SEED=5
N ?= 100
SEED ?= 1
mutants: .venv/ready
	$(BIN)/python -m tests.mutants $(N) --seed $(SEED)

# An hour on each reader.
fuzz: .venv/ready
	for reader in $$($(BIN)/python -m tests.fuzz.keeping); do nice $(BIN)/python -m tests.fuzz $$reader --seconds 3600 || exit 1; done

clean:
	rm -rf .venv build report board site .mutants *.egg-info
