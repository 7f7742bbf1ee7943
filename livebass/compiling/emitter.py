"""Compiles all kernels in one pass, ahead of time: LLVM's O3 of numba's IR, for a named level of processor.

    python -m livebass.compiling.emitter LEVEL

writes the object file (processes.py). The functions of all entries are one module (lowering.py) in which everything but
the entries is internal; `lb_NAME` is the entry NAME with C's calling convention. Nothing is run here, so that code for
other machines can be made; numba is not needed where the module came with the package or is kept.
"""

from __future__ import annotations

import gzip
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass

from livebass.compiling import lowering, processes, store

# What machine code may need of the C library, or of LLVM's own runtime.
ALLOWED = {"memset", "memcpy", "memmove"}
# Functions that the module calls: numpy's square root, a call of C's, is the processor's instruction; the word that
# controls floating point, and the bits of it that take denormal numbers for zero, go by the kind of processor.
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
LOWERED, OPTIMISED = 0.6, 0.9  # parts of the time after which there are IR and optimised IR
ADDRESS = re.compile(r"inttoptr \(i64 \d")  # of the compiler's process


@dataclass(frozen=True)
class Level:
    """A kind of processor: what LLVM calls it, and the instructions it has beyond."""

    cpu: str
    features: str = ""
    machine: str = "x86_64"  # as Linux calls it
    triple: str = ""  # of the one system that it is for; "": of any


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


# Functions, by file and C name, that run once a bass or a message, and not while it sounds: compiled for size
SMALL = re.compile(
    r"(lb_(fill|measure|check|new|jack)_|(preparing|note|coil|answers|bench|check|pool|setup|strings|instrument|law|fourier"
    r"|response|floor|glide|ahead|thumb|desk|controls|messages|notes)\.)"
)


def program(progress: processes.Progress = processes.silent) -> str:
    """Returns the program that LLVM compiles: `packed_program`."""
    return gzip.decompress(packed_program(progress)).decode()


def packed_program(progress: processes.Progress = processes.silent) -> bytes:
    """Returns `lowering.program`, which came with the package, is kept in the user's directory, or is made; by gzip."""

    def made() -> bytes:
        return gzip.compress(lowering.program(progress).encode(), 6, mtime=0)

    came = store.whole(store.program_built())
    return store.kept_or_made(store.program_kept(), made) if came is None else came


def emit(
    text: str, level: str, triple: str | None = None, optimised: Callable[[], None] = lambda: None
) -> tuple[bytes, set[str]]:
    """Returns the object file of the program `text` for `level`, and the symbols that it needs.

    `triple`: another system than this one; `optimised` is called before machine code is made. Raises ValueError if the
    code needs what it must not.
    """
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
    head = f'target triple = "{triple}"\ntarget datalayout = "{machine.target_data}"\n'
    module = llvm.parse_assembly(head + text)
    module.link_in(llvm.parse_assembly(head + SQRT + PROCESSOR[kind.machine]))
    for function in module.functions:
        if not function.is_declaration and not function.name.startswith("lb_"):
            function.linkage = "internal"
        if not function.is_declaration and SMALL.match(function.name):
            function.add_function_attribute("optsize")
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization, options.loop_interleaving, options.loop_unrolling = True, True, True
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    optimised()
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
    return machine.emit_object(module), needs


def main(level: str) -> None:
    """Compiles the kernels for `level`."""

    def work(tell: processes.Progress) -> bytes:
        text = program(lambda part: tell(LOWERED * part))
        tell(LOWERED)
        return emit(text, level, optimised=lambda: tell(OPTIMISED))[0]

    processes.serve(work)


if __name__ == "__main__":
    main(*sys.argv[1:])
