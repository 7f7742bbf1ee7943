"""Compiles all kernels in one pass, ahead of time: LLVM's O3 of numba's IR, for a named level of processor.

O3 gives the same IR for every system, so a release optimises once per level. Machine code is per system.

    python -m livebass.compiling.emitter LEVEL

writes the object file (processes.py). The functions of all entries form one module (lowering.py) in which all but the
entries is internal; `lb_NAME` is the entry NAME with C's calling convention. It runs none of the code, and so can
compile for other machines. It needs no numba if the module came with the package or is cached.
"""

from __future__ import annotations

import gzip
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from livebass.compiling import lowering, processes, store

# Functions that machine code may need from the C library or LLVM's runtime.
ALLOWED = {"memset", "memcpy", "memmove"}
# Functions that the module calls. numpy's square root, a C call, becomes the processor's instruction; the control word
# of floating point, and its bits that treat denormal numbers as zero, depend on the kind of processor.
SQRT = """define double @sqrt(double %x) alwaysinline {
  %y = call double @llvm.sqrt.f64(double %x)
  ret double %y
}
declare double @llvm.sqrt.f64(double)
"""
CONTROL = """define i64 @float_control() alwaysinline {{
  {}
}}
define void @set_float_control(i64 %word) alwaysinline {{
  {}
  ret void
}}
define i64 @flush_bits() alwaysinline {{
  ret i64 {}
}}
"""
PROCESSOR = {
    "x86_64": CONTROL.format(
        "%slot = alloca i32 call void @llvm.x86.sse.stmxcsr(ptr %slot) "
        "%short = load i32, ptr %slot %word = zext i32 %short to i64 ret i64 %word",
        "%slot = alloca i32 %short = trunc i64 %word to i32 store i32 %short, ptr %slot "
        "call void @llvm.x86.sse.ldmxcsr(ptr %slot)",
        0x8040,  # FTZ and DAZ of MXCSR
    ) + "declare void @llvm.x86.sse.stmxcsr(ptr)\ndeclare void @llvm.x86.sse.ldmxcsr(ptr)\n",
    "aarch64": CONTROL.format(
        "%word = call i64 @llvm.aarch64.get.fpcr() ret i64 %word",
        "call void @llvm.aarch64.set.fpcr(i64 %word)",
        1 << 24,  # FZ of FPCR
    ) + "declare i64 @llvm.aarch64.get.fpcr()\ndeclare void @llvm.aarch64.set.fpcr(i64)\n",
    "wasm32": CONTROL.format("ret i64 0", "", 0),
}  # fmt: skip
LOWERED, OPTIMISED = 0.6, 0.9  # fractions of the time until IR and optimised IR are ready
ADDRESS = re.compile(r"inttoptr \(i64 \d")  # of the compiler's process
TARGET = re.compile(r"^target (triple|datalayout) = .*\n", re.MULTILINE)


@dataclass(frozen=True)
class Level:
    """A kind of processor: LLVM's name, and its additional instructions."""

    cpu: str
    features: str = ""
    machine: str = "x86_64"  # as Linux calls it
    triple: str = ""  # of its only system; "": any


LEVELS = {
    "x86-64-v2": Level("x86-64-v2"),
    "x86-64-v3": Level("x86-64-v3"),
    "arm64": Level("generic", "+neon", "aarch64"),
    "wasm32": Level(
        "generic",
        "+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals",
        "wasm32",
        "wasm32-unknown-unknown",
    ),
}


def program(progress: processes.Progress = processes.silent) -> str:
    """Returns the program that LLVM compiles: `packed_program`."""
    return gzip.decompress(packed_program(progress)).decode()


def packed_program(progress: processes.Progress = processes.silent) -> bytes:
    """Returns the gzipped `lowering.program`: from the package, from the user's directory, or newly made."""

    def made() -> bytes:
        return gzip.compress(lowering.program(progress).encode(), 6, mtime=0)

    came = store.whole(store.program_built())
    return store.kept_or_made(store.program_kept(), made) if came is None else came


def parse_ir(text: str, level: str, triple: str | None = None) -> tuple[Any, Any]:
    """Returns the machine of `level`, and the program `text` as a module for it that exports only the entries.

    `triple`: another system than this one.
    """
    import llvmlite.binding as llvm

    machine, head = _machine(level, triple)
    module = llvm.parse_assembly(head + text)
    module.link_in(llvm.parse_assembly(head + SQRT + PROCESSOR[LEVELS[level].machine]))
    for function in module.functions:
        if not function.is_declaration and not function.name.startswith("lb_"):
            function.linkage = "internal"
    module.verify()
    return machine, module


def _machine(level: str, triple: str | None) -> tuple[Any, str]:
    """Returns LLVM's machine of `level`, and the first lines of a module for it."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    kind = LEVELS[level]
    triple = triple or kind.triple or llvm.get_process_triple()
    machine = llvm.Target.from_triple(triple).create_target_machine(
        cpu=kind.cpu,
        features=kind.features,
        opt=3,
        reloc="static" if kind.machine == "wasm32" else "pic",
        codemodel="default",
    )
    return machine, f'target triple = "{triple}"\ntarget datalayout = "{machine.target_data}"\n'


def optimise(text: str, level: str) -> tuple[str, set[str]]:
    """Returns the optimised IR of the program `text` for `level`, on any system, and the symbols it needs.

    Raises ValueError if the code needs a forbidden symbol.
    """
    import llvmlite.binding as llvm

    kind = LEVELS[level]
    machine, module = parse_ir(text, level, kind.triple or f"{kind.machine}-unknown-linux-gnu")
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.loop_interleaving = True, True
    options.slp_vectorization, options.loop_unrolling = False, False  # unrolled: a fifth longer, and not faster
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    final = str(module)
    if ADDRESS.search(final):
        raise ValueError("an address of the compiler's process is in the code")
    used = re.sub(r"^declare.*$", "", final, flags=re.MULTILINE)
    needs = {
        f.name for f in module.functions
        if f.is_declaration and not f.name.startswith("llvm.") and f"@{f.name}(" in used
    }  # fmt: skip
    if needs - ALLOWED:
        raise ValueError(f"the code needs {', '.join(sorted(needs - ALLOWED))}")
    return TARGET.sub("", final), needs


def assemble(optimised_ir: str, level: str, triple: str | None = None) -> bytes:
    """Returns the object file of `optimise` IR for `level`. `triple`: another system than this one."""
    import llvmlite.binding as llvm

    machine, head = _machine(level, triple)
    return machine.emit_object(llvm.parse_assembly(head + optimised_ir))


def emit(
    text: str, level: str, triple: str | None = None, between: Callable[[], None] = lambda: None
) -> tuple[bytes, set[str]]:
    """Returns the object file of the program `text` for `level`, and the symbols it needs.

    `triple`: another system than this one; `between` is called before generating machine code. Raises ValueError if
    the code needs a forbidden symbol.
    """
    final, needs = optimise(text, level)
    between()
    return assemble(final, level, triple), needs


def main(level: str) -> None:
    """Compiles the kernels for `level`."""

    def work(tell: processes.Progress) -> bytes:
        text = program(lambda part: tell(LOWERED * part))
        tell(LOWERED)
        return emit(text, level, between=lambda: tell(OPTIMISED))[0]

    processes.serve(work)


if __name__ == "__main__":
    main(*sys.argv[1:])
