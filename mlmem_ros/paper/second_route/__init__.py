# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rows of the independent check: our number beside that of a second route."""
