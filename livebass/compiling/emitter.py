"""Compiles all kernels in one pass, ahead of time: numba's raw IR, then LLVM's O3 for a named level of processor.

    python -m livebass.compiling.emitter LEVEL

writes lines with the part that is done, an empty one, and the object file. numba's own optimiser is off: it would
vectorise for the processor at hand, function by function, and what is vectorised once stays so. Nothing is run here, so
that code for other machines can be made. The functions of all entries become one module in which everything but the
entries is internal; `lb_NAME` is the entry NAME with C's calling convention. numba reads its settings once: it needs a
process of its own, as this file started as a program is.
"""

from __future__ import annotations

import gc
import gzip
import importlib
import os
import re
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from livebass.compiling import MACHINE, store

LLVM_TYPES = {
    "void": "void", "voidptr": "ptr", "int32": "i32", "uint32": "i32", "int64": "i64", "uint64": "i64",
    "float64": "double",
}  # fmt: skip
ZEROS = {"ptr": "null", "double": "0.0"}
SETTINGS = {"LIVEBASS_FROM_SOURCE": "1", "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}  # of the environment
# What machine code may need of the C library, or of LLVM's own runtime.
ALLOWED = {"memset", "memcpy", "memmove"}
# numpy's square root is a call of C's; here it is the processor's instruction.
SQRT = """define double @sqrt(double %x) alwaysinline {
  %y = call double @llvm.sqrt.f64(double %x)
  ret double %y
}
declare double @llvm.sqrt.f64(double)"""
COLLECTED = 200_000, 50, 1000  # thresholds of the garbage collector: by itself it takes a fifth of numba's time
LOWERED, OPTIMISED = 0.78, 0.95  # parts of the time after which there are IR and optimised IR
END = b"\n"  # of the lines with the part that is done
ADDRESS = re.compile(r"inttoptr \(i64 \d")  # of this process


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


def prepare_numba() -> None:
    """Makes numba stop at raw IR. Before its first use."""
    from numba.core import codegen

    library: Any = codegen.CPUCodeLibrary
    jit: Any = codegen.JITCodeLibrary
    context: Any = codegen.JITCPUCodegen

    def keep_layout(self: Any, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    library._optimize_functions = keep_layout
    library._optimize_final_module = lambda self: None
    context._add_module = lambda self, module: None
    jit._finalize_specific = lambda self: None
    jit.get_pointer_to_function = lambda self, name: self._ensure_finalized() or 0
    context.set_env = lambda self, name, env: None


def entries() -> dict[str, Any]:
    """All entries, by name. Imports the files of the kernels."""
    from livebass.compiling import ENTRIES

    for source in store.sources():
        module = source.relative_to(store.PACKAGE.parent).with_suffix("").as_posix().replace("/", ".")
        if not module.startswith("livebass.compiling"):
            importlib.import_module(module.removesuffix(".__init__"))
    return dict(sorted(ENTRIES.items()))


def silent(done: float) -> None:
    """Tells nobody what part is `done`."""


def program(tell: Callable[[float], None] = silent) -> str:
    """Returns `compiled_program`, which is kept in the user's directory: a second level takes half the time."""
    place = store.directory(f"kernels-{store.digest()}")
    kept = place / f"{MACHINE}.ll.gz" if place else None
    return gzip.decompress(store.kept_or_made(kept, lambda: gzip.compress(compiled_program(tell).encode(), 1))).decode()


def compiled_program(tell: Callable[[float], None] = silent) -> str:
    """The unoptimised IR of all entries as one module; tells what part of all functions is compiled.

    Changes numba (`prepare_numba`) and the garbage collector for this process.
    """
    gc.set_threshold(*COLLECTED)
    prepare_numba()
    import llvmlite.binding as llvm

    from livebass.compiling import by_numba

    whole, gates = None, []
    found = entries()
    by_numba.tell_progress(tell, found.values())
    for name, entry in found.items():
        raw, text = by_numba.raw_ir(entry)
        module = llvm.parse_assembly(text)
        module.get_function(raw).name = f"raw_{name}"
        gates.append(gate(entry))
        if whole is None:
            whole = module
        else:
            whole.link_in(module)
    assert whole is not None
    whole.link_in(llvm.parse_assembly("\n".join([*gates, SQRT])))
    for item in [*whole.functions, *whole.global_variables]:
        if not item.is_declaration and not item.name.startswith("lb_"):
            item.linkage = "internal"
    return str(whole)


def gate(entry: Any) -> str:
    """The IR of the C function `lb_NAME`, which calls numba's function: result by address, errors by status."""
    result = LLVM_TYPES[entry.result]
    kinds = [LLVM_TYPES[kind] for kind in entry.arguments]
    raw = f"raw_{entry.name}"
    given = "".join(f", {kind} %{i}" for i, kind in enumerate(kinds))
    held = "ptr" if result == "void" else result
    lines = [
        f"declare i32 @{raw}({', '.join(['ptr', 'ptr', *kinds])})",
        f"define {result} @lb_{entry.name}({given.lstrip(', ')}) {{",
        f"  %result = alloca {held}",
        "  %error = alloca ptr",
        f"  store {held} {ZEROS.get(held, '0')}, ptr %result",
        f"  %status = call i32 @{raw}(ptr %result, ptr %error{given})",
    ]
    if result == "void":
        return "\n".join([*lines, "  ret void", "}"])
    return "\n".join([*lines, f"  %value = load {result}, ptr %result", f"  ret {result} %value", "}"])


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
    text = re.sub(r"^target triple = .*$", f'target triple = "{triple}"', text, flags=re.MULTILINE)
    text = re.sub(r"^target datalayout = .*$", f'target datalayout = "{machine.target_data}"', text, flags=re.MULTILINE)
    module = llvm.parse_assembly(text)
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


def end_with_parent() -> None:
    """Ends this process when the one that started it has ended: its standard input ends then."""

    def watch() -> None:
        while os.read(0, 4096):
            pass
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def main(level: str) -> None:
    """Writes progress, and the object file for `level`, to standard output; or what went wrong, and exits with 1."""
    out = os.dup(1)
    os.dup2(2, 1)  # whatever is printed is no part of it
    end_with_parent()

    def tell(done: float) -> None:
        os.write(out, b"%.3f\n" % done)

    try:
        text = program(lambda part: tell(LOWERED * part))
        tell(LOWERED)
        data, _ = emit(text, level, optimised=lambda: tell(OPTIMISED))
        status = 0
    except Exception as error:
        data, status = f"{type(error).__name__}: {error}".encode(), 1
    with open(out, "wb") as file:
        file.write(END + data)
    os._exit(status)  # the thread waits


if __name__ == "__main__":
    main(*sys.argv[1:])
