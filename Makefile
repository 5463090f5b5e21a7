# Two commands:  make run   the McPherson strut in every engine, compared and reported
#                make test  style, types and tests
# Plain Python with venv is enough; uv is used when it is there.
PYTHON ?= python3
BIN := .venv/bin
UV := $(shell command -v uv 2>/dev/null)

.PHONY: run test lock fuzz clean

run: .venv/ready
	$(BIN)/kincheck run mcpherson_strut --out report

test: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/pytest --numprocesses auto

.venv/ready: pyproject.toml requirements.lock core/version.py
ifdef UV
	uv venv --quiet --allow-existing --python $(PYTHON) .venv
	uv pip install --quiet --compile-bytecode --python $(BIN)/python --requirement requirements.lock
	uv pip install --quiet --python $(BIN)/python --no-deps --editable .
else
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --editable .
endif
	# what is installed as editable is not compiled, and where Python may not write bytecode every process would do it again
	$(BIN)/python -m compileall -q core adapters cases
	touch $@

# Pin the newest versions that pyproject.toml allows.
lock: .venv/ready
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --upgrade \
		--extra dev pyproject.toml --output-file requirements.lock

# An hour on each reader.
fuzz: .venv/ready
	for reader in casefile hardpoints mjcf reference results; do nice $(BIN)/python -m tests.fuzz $$reader --seconds 3600 || exit 1; done

clean:
	rm -rf .venv build report *.egg-info
