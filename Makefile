# Two commands for a newcomer: "make demo" and "make test". Both set up what they need.
PYTHON ?= python3
VENV = .venv/bin
# Four workers: half of the time is spent waiting for nodes. Files start in the order of
# test/conftest.py.
PYTEST = pytest -n 4 --dist loadfile --no-loadscope-reorder
# What "make coverage" measures, and the branch coverage in per cent below which it fails.
# Tracing takes up to half as much processor time again, so the other tests run without.
MEASURED = test/device test/library test/checks test/bag test/contract test/host test/rig test/sessions test/ros
FLOORS = mlmem=99 mlmem_tools/checks=96 mlmem_ros/contract=96 mlmem_ros/bag=98 mlmem_ros/session=98 mlmem_ros/host=95 mlmem_ros/ros=96
SAMPLE = 160
SEED = 1

MINUTES ?= 60
SEEDS ?= 100000

.PHONY: bench clean coverage demo dist docs figures figures-check figures-stale interfaces lint mutation seeded-runs setup setup-docs setup-kilted setup-test soak test test-kilted test-oldest test-slow uncovered

demo: setup
	$(VENV)/mlmem demo

figures: setup-test
	$(VENV)/mlmem figures

# Compares the pages with the result files, and the pictures with the hashes of their bytes.
figures-check: setup-test
	$(VENV)/python -m mlmem_lab.numbers --check

# Lists the results whose modules have changed, with command and time.
figures-stale: setup-test
	@$(VENV)/python -m mlmem_lab.numbers --stale

bench: setup-test
	$(VENV)/mlmem bench

# All but the code of the pages, which "make docs" runs.
test: lint interfaces
	$(VENV)/python -m $(PYTEST) --ignore=test/docs

# The pages do what they print, then the site: docs/_build/index.html. Warnings are errors, links within
# it are checked; so are contrast and names, where Chromium and axe-core are installed.
docs: setup-docs interfaces
	$(VENV)/python -m pytest test/docs
	$(VENV)/python scripts/reference.py
	$(VENV)/sphinx-build --quiet --fail-on-warning --keep-going docs docs/_build
	$(VENV)/python scripts/check_site.py

# A source archive and a wheel in dist/. The wheel is checked in a fresh environment without ROS 2.
dist: setup
	rm -rf dist build
	$(VENV)/python setup.py --quiet sdist
	$(VENV)/python -m pip wheel --quiet --no-deps --wheel-dir dist dist/*.tar.gz
	$(PYTHON) -m venv dist/check
	dist/check/bin/python -m pip install --quiet dist/*.whl
	dist/check/bin/mlmem demo
	rm -rf dist/check build

# The same tests, and how much of the code they reach; before a release.
coverage: lint interfaces
	$(VENV)/coverage erase
	$(VENV)/coverage run -m $(PYTEST) $(MEASURED)
	$(VENV)/python -m $(PYTEST) --ignore=test/docs $(MEASURED:%=--ignore=%)
	$(VENV)/coverage combine --quiet
	@status=0; for floor in $(FLOORS); do \
	  package=$${floor%=*}; printf '%-20s branch coverage in %%: ' $$package; \
	  $(VENV)/coverage report --format=total --fail-under=$${floor#*=} \
	    --include="*/$$package/*" --omit="*/mlmem/physics/*" || status=$$?; \
	done; exit $$status

# What it has left uncovered, line by line.
uncovered:
	$(VENV)/coverage report

# The tests of nodes with ROS 2 Kilted, in an environment of their own.
test-kilted: setup-kilted
	@.venv-kilted/bin/python scripts/build_interfaces.py || true
	.venv-kilted/bin/python -m $(PYTEST) test/ros test/host examples

# The same tests with the oldest versions that setup.py and lab/pyproject.toml allow, in an environment
# of their own; before a release.
test-oldest:
	$(PYTHON) -m venv --clear .venv-oldest
	.venv-oldest/bin/pip install --quiet uv
	.venv-oldest/bin/uv pip install --quiet --python .venv-oldest/bin/python \
	  --resolution lowest-direct --editable '.[ros,view,test]' --editable lab
	@.venv-oldest/bin/python scripts/build_interfaces.py || true
	.venv-oldest/bin/python -m pytest -n 4 --dist loadfile --ignore=test/docs

test-slow: setup-test
	$(VENV)/python -m pytest -m slow --timeout 0

soak: setup-test
	$(VENV)/python scripts/soak.py --minutes $(MINUTES)

# A sample of mutants, half an hour; make mutation SEED=2: another.
mutation: setup-test
	$(VENV)/pip install --quiet --editable '.[mutation]'
	$(VENV)/python scripts/mutation.py --sample $(SAMPLE) --seed $(SEED)

# Seeded runs, a night of them: make seeded-runs SEEDS=1000000
seeded-runs: setup-test
	$(VENV)/python scripts/seeded_runs.py --count $(SEEDS)

# The package of actions, where cmake and a compiler are; its tests are skipped elsewhere.
interfaces: setup-test
	@$(VENV)/python scripts/build_interfaces.py || true

lint: setup-test
	$(VENV)/ruff check
	$(VENV)/ruff format --check
	$(VENV)/mypy

setup: STAGE = demo
setup-test: STAGE = test
setup-docs: STAGE = docs
setup-kilted: STAGE = test-kilted
setup setup-test setup-docs setup-kilted:
	@command -v $(PYTHON) >/dev/null || { echo "$(PYTHON) is missing: install Python 3.10 to 3.14 (sudo apt install python3 python3-venv), or name one: make PYTHON=/path/to/python demo" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { echo "$(PYTHON) is too old for the ROS 2 wheels, which need Python 3.10 to 3.14; name another one: make PYTHON=python3.12 demo. On a robot use ROS 2 Jazzy from apt and colcon instead: see README.md." >&2; exit 1; }
	@$(PYTHON) scripts/bootstrap.py $(STAGE)

clean:
	rm -rf .venv .venv-kilted .venv-oldest build dist docs/_build *.egg-info sessions reproduction mutants .coverage*
