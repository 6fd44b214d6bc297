# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compile the loops for ARM64, run them in an emulator, and compare the bits with those here.

Usage: .venv/bin/python scripts/arm64_bits.py. It needs Debian's gcc-aarch64-linux-gnu and
qemu-user-static. LLVM optimises numba's unoptimised code of a loop for a Cortex-A72; a C program
without a library calls it with the arrays of test/physics/test_bits.py, and prints them
afterwards.
"""

import os
import re
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

os.environ['NUMBA_OPT'] = '0'
sys.path += [str(Path(__file__).parent.parent / 'test' / 'physics')]

import llvmlite.binding as llvm
import numba
import numpy as np
import test_bits

from mlmem.physics import INTEGRATORS, jit
from mlmem.physics.stepping import Inputs

TRIPLE = 'aarch64-unknown-linux-gnu'
GCC = ('aarch64-linux-gnu-gcc', '-O1', '-ffreestanding', '-fno-builtin', '-w')

PROGRAM = """
typedef unsigned long size;
extern char data[], data_end[];
__asm__(".data\\n.balign 64\\n.globl data\\ndata:\\n.incbin \\"{folder}/data\\"\\n"
        ".globl data_end\\ndata_end:\\n.text\\n");
int loop(void *, void **, {types}) __asm__("{name}");
static long call(long n, long a, long b, long c) {{
    register long x8 __asm__("x8") = n, x0 __asm__("x0") = a;
    register long x1 __asm__("x1") = b, x2 __asm__("x2") = c;
    __asm__ volatile("svc 0" : "+r"(x0) : "r"(x8), "r"(x1), "r"(x2) : "memory");
    return x0;
}}
void _start(void) {{
    char result[64]; void *exception = 0;
    int failed = loop(result, &exception, {values}) > 0;
    for (char *at = data; at < data_end;) at += call(64, 1, (long)at, data_end - at);
    call(93, failed, 0, 0);
}}
void *memset(void *to, int c, size n) {{ char *p = to; while (n--) *p++ = c; return to; }}
void *memcpy(void *to, const void *from, size n) {{
    char *p = to; const char *q = from; while (n--) *p++ = *q++; return to;
}}
"""


def leaves(value: Any) -> list[Any]:
    """Return an argument as numba hands it over: arrays stand for their addresses."""
    if isinstance(value, tuple):
        return [leaf for each in value for leaf in leaves(each)]
    if isinstance(value, np.ndarray):
        sizes = [value.size, value.itemsize]
        return [None, None, *sizes, value, *value.shape, *value.strides]
    return [value]


def compiled_for_arm(ir: str) -> bytes:
    """Return the object of a module that numba has made for the host."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    ir = re.sub('target triple = ".*"', f'target triple = "{TRIPLE}"', ir)
    module = llvm.parse_assembly(re.sub('target datalayout = ".*"', '', ir))
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(
        cpu='cortex-a72', opt=3, reloc='static', codemodel='small'
    )
    module.data_layout = str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = True
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(module, passes)
    print(
        len(re.findall(r'fml[as]\tv\S+2d', machine.emit_assembly(module))), 'vector fma', end=' '
    )
    return bytes(machine.emit_object(module))


def same(loop: Any, arguments: tuple[Any, ...], folder: Path) -> bool:
    """Run a loop here and there, and return whether all its arrays are the same afterwards."""
    fresh = numba.njit(**jit.NUMBA_SETTINGS)(loop.py_func)
    fresh.compile(tuple(numba.typeof(each) for each in arguments))
    (signature,) = fresh.signatures
    data, types, values, places = b'', [], [], []
    for leaf in leaves(arguments):
        if isinstance(leaf, np.ndarray):
            data += b'\0' * (-len(data) % 64)
            places.append((len(data), leaf))
            values.append(f'(long)(data + {len(data)})')
            data += leaf.tobytes()
        else:
            values.append('0' if leaf is None else float.hex(leaf) if type(leaf) is float
                          else str(int(leaf)))  # fmt: skip
        types.append('double' if type(leaf) is float else 'long')
    (folder / 'data').write_bytes(data)
    (folder / 'loop.o').write_bytes(compiled_for_arm(fresh.inspect_llvm(signature)))
    name = fresh.overloads[signature].fndesc.llvm_func_name
    text = PROGRAM.format(
        folder=folder, name=name, types=', '.join(types), values=', '.join(values)
    )
    undefined = subprocess.check_output(
        ('aarch64-linux-gnu-nm', '-u', folder / 'loop.o'), text=True
    )
    text += ''.join(
        f'long {each}(void) {{ return 0; }}\n'
        for each in set(undefined.split()) - {'U', 'memset', 'memcpy'}
    )
    (folder / 'main.c').write_text(text)
    files = folder / 'main.c', folder / 'loop.o', '-o', folder / 'program'
    subprocess.run((*GCC, '-nostdlib', '-static', *files), check=True)
    there = subprocess.check_output(('qemu-aarch64-static', folder / 'program'))
    loop(*arguments)
    return all(there[at : at + here.nbytes] == here.tobytes() for at, here in places)


def main() -> int:
    """Compare every method over every substrate."""
    agree = []
    warnings.simplefilter('ignore')  # numba keeps no unoptimised code, and says so
    for method, substrate in test_bits.BITS:
        chain, inputs = test_bits.case(method, substrate)
        ends = np.empty((2, len(inputs[0]) // chain.integrator.substeps))
        print(method, substrate, end=': ')
        with tempfile.TemporaryDirectory() as folder:
            arguments = chain._build_arguments(Inputs(*inputs), ends)
            agree.append(same(INTEGRATORS[method].advance, arguments, Path(folder)))
        print('the same bits' if agree[-1] else 'OTHER BITS')
    return 0 if all(agree) else 1


if __name__ == '__main__':
    sys.exit(main())
