# Two commands for a newcomer: "make demo" and "make test". Both set up what they need.
PYTHON ?= python3
VENV = .venv/bin

MINUTES ?= 60

.PHONY: bench demo figures test test-slow soak lint setup clean

demo: setup
	$(VENV)/mlmem demo

figures: setup
	$(VENV)/mlmem figures

bench: setup
	$(VENV)/mlmem bench

test: setup lint
	$(VENV)/python -m pytest -n 2 --dist loadfile

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
	rm -rf .venv build *.egg-info sessions reproduction benchmarks
