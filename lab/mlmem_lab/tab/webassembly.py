# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The product's PEFRL loop as WebAssembly: python3 -m mlmem_lab.tab.webassembly [FOLDER].

numba writes the loop for a rigid substrate as LLVM's intermediate code, llvmlite compiles that for
wasm32, and what a linker would do is done here: the one function needs no other, no data and no
stack, so that its object file only lacks a memory and the names to reach both.

Two modules are made. WebAssembly has no fused multiply-add. In `pefrl_exact.wasm` each is made of
the operations that it has, with one rounding: its bits are those of `physics.jit.fma` while no
product is so small or so large that a part of it underflows or overflows. `pefrl.wasm` rounds
twice, and is some ten times faster.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

MODULE_FOLDER = Path(__file__).parents[3] / 'docs' / 'try'
"""Where the modules are, in a checkout."""

MODULE_NAMES = {True: 'pefrl_exact.wasm', False: 'pefrl.wasm'}
"""Of the modules, by whether they are exact."""

MEMORY_PAGES = 16
"""Pages of 64 kB that a module's memory has at first."""

MEMORY, EXPORTS = 5, 7
"""Numbers of sections, which follow each other in this order; 2 is that of imports, 0 of notes."""

FAST_FUSED_CODE = """
define internal double @fused(double %a, double %b, double %c) alwaysinline {
  %p = fmul double %a, %b
  %s = fadd double %p, %c
  ret double %s
}
"""
"""a b + c, rounded twice."""

EXACT_FUSED_CODE = """
define internal double @fused(double %a, double %b, double %c) alwaysinline {
  ; a b = p + e, by Veltkamp's halves
  %p = fmul double %a, %b
  %a.s = fmul double %a, 134217729.0
  %a.d = fsub double %a.s, %a
  %a.h = fsub double %a.s, %a.d
  %a.l = fsub double %a, %a.h
  %b.s = fmul double %b, 134217729.0
  %b.d = fsub double %b.s, %b
  %b.h = fsub double %b.s, %b.d
  %b.l = fsub double %b, %b.h
  %hh = fmul double %a.h, %b.h
  %hl = fmul double %a.h, %b.l
  %lh = fmul double %a.l, %b.h
  %ll = fmul double %a.l, %b.l
  %e.0 = fsub double %hh, %p
  %e.1 = fadd double %e.0, %hl
  %e.2 = fadd double %e.1, %lh
  %e = fadd double %e.2, %ll
  ; c + e = s + t
  %s = fadd double %c, %e
  %s.0 = fsub double %s, %c
  %s.1 = fsub double %s, %s.0
  %s.2 = fsub double %c, %s.1
  %s.3 = fsub double %e, %s.0
  %t = fadd double %s.2, %s.3
  ; p + s = h + l
  %h = fadd double %p, %s
  %h.0 = fsub double %h, %p
  %h.1 = fsub double %h, %h.0
  %h.2 = fsub double %p, %h.1
  %h.3 = fsub double %s, %h.0
  %l = fadd double %h.2, %h.3
  ; t + l, rounded to an odd last bit if it is rounded
  %o = fadd double %t, %l
  %o.0 = fsub double %o, %t
  %o.1 = fsub double %o, %o.0
  %o.2 = fsub double %t, %o.1
  %o.3 = fsub double %l, %o.0
  %rest = fadd double %o.2, %o.3
  %bits = bitcast double %o to i64
  %rounded = fcmp une double %rest, 0.0
  %last = and i64 %bits, 1
  %even = icmp eq i64 %last, 0
  %wrong = and i1 %rounded, %even
  %up = fcmp ogt double %rest, 0.0
  %positive = icmp sge i64 %bits, 0
  %inward = xor i1 %up, %positive
  %by = select i1 %inward, i64 -1, i64 1
  %beside = add i64 %bits, %by
  %odd = select i1 %wrong, i64 %beside, i64 %bits
  %low = bitcast i64 %odd to double
  %sum = fadd double %h, %low
  ret double %sum
}
"""
"""a b + c, rounded once: Boldo and Melquiond, IEEE Trans. Comput. 57 (2008) 462."""


def compile_loop() -> tuple[str, str]:
    """Return the loop in LLVM's intermediate code, and the name of its function; it must not have
    been optimised for the processor of this machine.
    """
    import numba
    import numpy as np

    from mlmem.physics.methods.integrator import Cells, Forcing
    from mlmem.physics.methods.pefrl import Constants, advance

    known: Any = numba
    types, carray = known.types, known.carray

    def run(
        u: Any, du: Any, x: Any, height: Any, origin: Any, mobility: Any, under: Any, decay: Any,
        kick: Any, push: Any, drifts: Any, V_N: Any, shake: Any, motion: Any, ends: Any,
        stuck: Any, n: Any, stuck_n: Any, steps: Any, driven: Any, site: Any, a: Any, b: Any,
        start: Any,
    ) -> None:  # fmt: skip
        nodes = 5 * steps
        cells = Cells(
            (carray(height, n), a, b), (), carray(origin, n), carray(mobility, n),
            carray(under, n), carray(stuck, stuck_n), 0.0,
        )  # fmt: skip
        forcing = Forcing(
            carray(V_N, nodes), carray(shake, nodes), site, driven, carray(motion, (2, nodes)),
            steps, -np.inf, np.inf, 0.0, start,
        )  # fmt: skip
        lengths, v = carray(drifts, 5), carray(du, n)
        constants = Constants(
            lengths, carray(decay, (2, n)), carray(kick, (2, n)), carray(push, (2, n)),
            lengths, lengths,
        )  # fmt: skip
        chain = carray(u, n + 2), v, v, carray(x, (2, n + 2))
        advance(
            steps, chain, None, cells, forcing, constants, carray(ends, (2, steps)), None, None
        )

    reals, integers = types.CPointer(types.float64), types.CPointer(types.int64)
    taken = (reals,) * 15 + (integers,) + (types.int64,) * 5 + (types.float64,) * 3
    compiled: Any = numba.njit(nogil=True, error_model='numpy')(run)
    compiled.compile(types.void(*taken))
    made = compiled.overloads[taken]
    return made.library.get_llvm_str(), made.fndesc.llvm_func_name


def compile_object(exact: bool) -> bytes:
    """Return the object file of the loop as function `run`."""
    import llvmlite.binding as llvm

    text, name = compile_loop()
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple('wasm32-unknown-unknown')
    machine = target.create_target_machine(features='+simd128', opt=3)
    text = text.replace(f'@{name}(', '@run(')
    for counted in ('NRT_incref', 'NRT_decref'):  # all arrays are views of the caller's memory
        text = re.sub(
            rf'define linkonce_odr void @{counted}\(ptr \S+\).*?^\}}',
            f'define internal void @{counted}(ptr %view) alwaysinline {{\n  ret void\n}}',
            text, flags=re.DOTALL | re.MULTILINE,
        )  # fmt: skip
    text = re.sub(r'^declare double @llvm\.fma\.f64.*$', '', text, flags=re.MULTILINE)
    text = text.replace('@llvm.fma.f64(', '@fused(')
    for key, value in (('datalayout', machine.target_data), ('triple', target.triple)):
        text = re.sub(rf'^target {key}.*$', f'target {key} = "{value}"', text, flags=re.MULTILINE)
    module = llvm.parse_assembly(text + (EXACT_FUSED_CODE if exact else FAST_FUSED_CODE))
    for each in (*module.functions, *module.global_variables):
        if not each.is_declaration and each.name != 'run':
            each.linkage = 'internal'  # and goes, as far as `run` does not use it
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(3))
    builder.getModulePassManager().run(module, builder)
    told: bytes = machine.emit_object(module)
    return told


def link_module(told: bytes) -> bytes:
    """Return a module that exports `run` and `memory`, made of an object file.

    Raises:
        ValueError: The object needs a linker: it has data, or uses what it does not define.
    """
    head, parts = told[:8], dict(_iterate_sections(told))
    if unexpected := set(parts) - {0, 1, 2, 3, 10, 12}:
        raise ValueError(f'the loop must need code only; got sections {sorted(unexpected)}')
    if parts[2][:1] != b'\x01' or b'__linear_memory' not in parts[2]:
        raise ValueError(f'the loop must import nothing but a memory; got {parts[2]!r}')
    parts[MEMORY] = b'\x01\x00' + _encode_number(MEMORY_PAGES)
    names = ((b'run', 0, 0), (b'memory', 2, 0))
    exports = (bytes([len(name)]) + name + bytes([kind, index]) for name, kind, index in names)
    parts[EXPORTS] = bytes([len(names)]) + b''.join(exports)
    kept = (1, 3, MEMORY, EXPORTS, 10)
    return head + b''.join(bytes([k]) + _encode_number(len(parts[k])) + parts[k] for k in kept)


def _iterate_sections(told: bytes) -> Any:
    """Yield number and content of the sections of an object file."""
    at = 8
    while at < len(told):
        number, size, shift, at = told[at], 0, 0, at + 1
        while True:
            size |= (told[at] & 127) << shift
            shift, at = shift + 7, at + 1
            if told[at - 1] < 128:
                break
        yield number, told[at : at + size]
        at += size


def _encode_number(value: int) -> bytes:
    """Return a whole number in LEB128."""
    out = []
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def main(folder: Path) -> None:
    """Write both modules."""
    if os.environ.get('NUMBA_OPT') != '0':  # which counts when numba is imported
        command = [sys.executable, '-m', 'mlmem_lab.tab.webassembly', str(folder)]
        subprocess.run(command, env={**os.environ, 'NUMBA_OPT': '0'}, check=True)
        return
    for exact, name in MODULE_NAMES.items():
        module = link_module(compile_object(exact))
        (folder / name).write_bytes(module)
        print(f'{folder / name}: {len(module)} bytes')


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else MODULE_FOLDER)
