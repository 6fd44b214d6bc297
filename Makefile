# Two commands for a newcomer: "make demo" and "make test". Both set up what they need.
PYTHON ?= python3
VENV = .venv/bin
PYTEST = pytest -n 2 --dist loadfile
# The tests that "make test" measures, and the branch coverage in per cent below which it fails.
# Tracing takes half as much again of their processor time, so the others run without.
MEASURED = test/device test/bag test/sessions test/ros
FLOORS = device=98 bag=98 ros=95

MINUTES ?= 60

.PHONY: bench coverage demo figures lint setup soak test test-slow clean

demo: setup
	$(VENV)/mlmem demo

figures: setup
	$(VENV)/mlmem figures

bench: setup
	$(VENV)/mlmem bench

test: setup lint
	$(VENV)/coverage erase
	$(VENV)/coverage run -m $(PYTEST) $(MEASURED)
	$(VENV)/python -m $(PYTEST) $(MEASURED:%=--ignore=%)
	$(VENV)/coverage combine --quiet
	@status=0; for floor in $(FLOORS); do \
	  package=$${floor%=*}; printf '%-6s branch coverage in %%: ' $$package; \
	  $(VENV)/coverage report --format=total --fail-under=$${floor#*=} \
	    --include="*/mlmem_ros/$$package/*" || status=$$?; \
	done; exit $$status

# What "make test" has left uncovered, line by line.
coverage:
	$(VENV)/coverage report

test-slow: setup
	$(VENV)/python -m pytest -m slow

soak: setup
	$(VENV)/python tools/soak.py --minutes $(MINUTES)

lint: setup
	$(VENV)/ruff check
	$(VENV)/ruff format --check
	$(VENV)/mypy

setup:
	@command -v $(PYTHON) >/dev/null || { echo "$(PYTHON) is missing: install Python 3.10 to 3.14 (sudo apt install python3 python3-venv), or name one: make PYTHON=/path/to/python demo" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { echo "$(PYTHON) is too old for the ROS 2 wheels, which need Python 3.10 to 3.14; name another one: make PYTHON=python3.12 demo. On a robot use ROS 2 Jazzy from apt and colcon instead: see README.md." >&2; exit 1; }
	@$(PYTHON) tools/bootstrap.py

clean:
	rm -rf .venv build *.egg-info sessions reproduction benchmarks .coverage*
