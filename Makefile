# make train   install what is missing, train on synthetic records, write models and report to out/
# make test    install what is missing, lint, check types, run every test, on up to four processors
# make bench   speed and size, as ratios within one run
# make fuzz    hostile files, faults, broken guards and long runs, by the ten thousand (an hour)
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/installed
OUT    ?= out
NS     := build/ns
SOURCES := simulate features models classify tests

.PHONY: train test browser lint bench fuzz clean
.DELETE_ON_ERROR:

train: $(STAMP)
	$(BIN)/bladewing train --out $(OUT)
	$(BIN)/bladewing report --quick --models $(OUT) --out $(OUT)

test: $(STAMP) lint browser
	$(BIN)/python -m pytest -n logical --maxprocesses 4 --dist loadfile

# The report's page is tried in a real browser. Where there is none, Debian's is installed if this user may.
browser:
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null \
	|| { command -v apt-get >/dev/null && apt-get update -qq \
	     && apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core; } >/dev/null 2>&1 \
	|| echo "No chromium, and it cannot be installed here: the report's browser tests will be skipped."

# Types are checked through a link, because a type checker sees nothing of an editable install.
lint: $(STAMP)
	$(BIN)/ruff check $(SOURCES)
	$(BIN)/ruff format --check $(SOURCES)
	@mkdir -p $(NS) && ln -sfn ../.. $(NS)/bladewing
	MYPYPATH=$(NS) $(BIN)/mypy -p bladewing.simulate -p bladewing.features -p bladewing.models -p bladewing.classify

bench: $(STAMP)
	$(BIN)/python -m pytest tests/benchmarks -o addopts="--import-mode=importlib" -q

fuzz: $(STAMP)
	$(BIN)/python -m tests.fuzz.long_run
	$(BIN)/python -m tests.fuzz.guided
	$(BIN)/python -m tests.fuzz.faults
	$(BIN)/python -m tests.fuzz.mutations
	$(BIN)/python -m tests.fuzz.predictions

# Made again only when the pins or the project's own description change. Compiled on all processors and without the
# packages' own tests, which takes a quarter off the time; what fails to compile is what is never imported.
$(STAMP): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt setuptools wheel
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --no-build-isolation -c constraints.txt -e '.[train,dev]'
	-$(BIN)/python -m compileall -qq -j 0 -x '/tests?/' $(VENV)/lib
	touch $@

clean:
	rm -rf build out
