"""Lowers Python functions to unoptimised IR with numba, which stops there: emitter.py optimises this program.

    python -m livebass.compiling.lowering PART PARTS

numba's optimiser is off: it would vectorise for this processor, function by function, and that cannot be undone. Nor
does numba link each function into its callers, or wrap it for Python: the text of each is kept once. A definition's
name is a digest of its text, including the digests it uses: the program is the same, byte for byte, whatever the number
of processes and the order of compiling.

numba reads its settings once, and this file changes it for good: run this file as a program, in a process of its own.
"""

from __future__ import annotations

import gc
import hashlib
import importlib
import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from types import CodeType, FunctionType, ModuleType
from typing import Any

from livebass.compiling import ENTRIES, Entry, processes, store
from livebass.system.cores import core_count

LLVM_TYPES = {
    "void": "void", "voidptr": "ptr", "int32": "i32", "uint32": "i32", "int64": "i64", "uint64": "i64",
    "float64": "double",
}  # fmt: skip
ZEROS = {"ptr": "null", "double": "0.0"}
# Of the environment. numba iterates over sets of names: their order, and so the IR's, depends on the hash seed.
SETTINGS = {
    "LIVEBASS_FROM_SOURCE": "1", "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "PYTHONHASHSEED": "0",
}  # fmt: skip
NAMED = "livebass.compiling.lowering"  # this module
COLLECTED = 200_000, 50, 1000  # thresholds of the garbage collector: by default it takes a fifth of numba's time
NAME = re.compile(r'(?<= )c"[^"]*"|@(?:"([^"]+)"|([\w.$]+))')  # or bytes of data, where @ is a plain character
NO_ADDRESS = 1  # for Python's objects, which machine code must not need: emitter.emit rejects it

Weights = dict[str, int]  # function names and lengths


def program(progress: processes.Progress = processes.silent, parts: int | None = None) -> str:
    """The unoptimised IR of all entries as one module, the same for all kinds of processors.

    `progress` gets the fraction done; `parts`: number of processes, one or two. Raises processes.Failed.
    """
    parts = parts or min(core_count(), 2)
    done = [0.0] * parts

    def of(part: int) -> dict[str, dict[str, str]]:
        def tell(of_part: float) -> None:
            done[part] = of_part
            progress(min(done))

        return json.loads(processes.result_of(NAMED, str(part), str(parts), settings=SETTINGS, progress=tell))

    pool = ThreadPoolExecutor(parts)
    try:  # the first failure
        found = [each.result() for each in as_completed([pool.submit(of, part) for part in range(parts)])]
    finally:
        pool.shutdown(wait=False)
    return link_modules(found)


def link_modules(parts: Iterable[Mapping[str, Mapping[str, str]]]) -> str:
    """The module of the `parts` that `compile_entries` returns: callees before callers, in the entries' order."""
    gates: dict[str, str] = {}
    definitions: dict[str, str] = {}
    declarations: dict[str, str] = {}
    for part in parts:
        gates |= part["gates"]
        definitions |= part["definitions"]
        declarations |= part["declarations"]
    placed: dict[str, str] = {}

    def place(text: str) -> None:
        for name in names_in(text):
            if name not in placed:
                placed[name] = ""
                if name in definitions:
                    place(definitions[name])
                    placed[name] = definitions[name]
                elif name in declarations:
                    placed[name] = declarations[name]

    for _, gate in sorted(gates.items()):
        place(gate)
    return "\n".join([*filter(None, placed.values()), *(gates[name] for name in sorted(gates))])


def names_in(text: str) -> Iterator[str]:
    """The names of functions and data in IR."""
    return (quoted or plain for quoted, plain in NAME.findall(text) if quoted or plain)


def compile_entries(entries: Iterable[Entry], tell: processes.Progress = processes.silent) -> dict[str, dict[str, str]]:
    """Compiles entries: returns their gates, by entry, and the required definitions and declarations, by name.

    Changes numba (`only_text`, `name_records_once`) and the garbage collector for this process.
    """
    gc.set_threshold(*COLLECTED)
    raw, declarations = only_text()
    name_records_once()
    from livebass.compiling import by_numba

    by_numba.tell_progress(tell, {function for entry in entries for function in reachable(entry.function)})
    digests: dict[str, str] = {}
    definitions: dict[str, str] = {}

    def by_digest(text: str, own: str = "") -> str:
        """Returns `text` with digests for names, except its own."""

        def digest(match: re.Match[str]) -> str:
            name = match[1] or match[2]
            if name not in raw or name == own:
                return match[0]
            if name not in digests:
                digests[name] = ""  # of functions that call each other in a circle: no digest can name them
                inside = by_digest(raw[name], name)
                readable = ".".join(name.removeprefix("_ZN").split(".")[-3:-1])
                digests[name] = f"{readable}.{hashlib.sha256(inside.replace(name, '').encode()).hexdigest()[:16]}"
                definitions[digests[name]] = inside.replace(f'@"{name}"', f'@"{digests[name]}"')
            assert digests[name], f"{name} is called by what it calls"
            return f'@"{digests[name]}"'

        return NAME.sub(digest, text)

    gates = {entry.name: by_digest(gate(entry, by_numba.lower(entry))) for entry in entries}
    return {"gates": gates, "definitions": definitions, "declarations": declarations}


def only_text() -> tuple[dict[str, str], dict[str, str]]:
    """Makes numba stop at the text of definitions and declarations; returns their dicts, by name. Call it first."""
    from llvmlite import ir
    from numba.core import base, codegen, fastmathpass, funcdesc, inline_closurecall, ir_utils, lowering

    from livebass.compiling import by_numba

    definitions: dict[str, str] = {}
    declarations: dict[str, str] = {}
    library: Any = codegen.JITCodeLibrary

    class Text(library):
        """Keeps the text of a compiled function; it finds the functions it calls by name."""

        def __init__(self, codegen_: Any, name: str) -> None:
            codegen.CodeLibrary.__init__(self, codegen_, name)

        def add_linking_library(self, _: Any) -> None:
            pass

        def add_ir_module(self, module: Any) -> None:
            notes: list[str] = []  # such as branch probabilities, by number
            for note in module.metadata:
                note.descr(notes)
            noted = [text for text in notes if text.strip()]
            # numba gives constants of all functions the same names: name each after its content
            data = {
                item.name: f".const.{hashlib.sha256(str(item.initializer).encode()).hexdigest()[:16]}"
                for item in module.globals.values()
                if item.name.startswith(".const.")
            }
            for item in module.globals.values():
                declared = item.is_declaration if isinstance(item, ir.Function) else item.initializer is None
                into = declarations if declared and item.linkage != "common" else definitions
                if isinstance(item, ir.Function) and not declared:
                    for attribute in by_numba.attributes_of(item.name):
                        item.attributes.add(attribute)
                text = re.sub(r"(?<=, )(![\w.]+) !(\d+)", lambda m: f"{m[1]} {noted[int(m[2])]}", internal(str(item)))
                text = NAME.sub(lambda m: f'@"{data.get(m[1] or m[2], m[1] or m[2])}"' if m[1] or m[2] else m[0], text)
                name = data.get(item.name, item.name)
                assert into.setdefault(name, text) == text, f"two definitions of {name}"

        def finalize(self) -> None:
            self._finalized = True

        def get_pointer_to_function(self, _: str) -> int:
            return 0

    jit: Any = codegen.JITCPUCodegen
    jit._library_class = Text
    jit.set_env = lambda self, name, env: None
    lower: Any = lowering.BaseLower
    lower.create_cpython_wrapper = lambda self, release_gil=False: None
    lower.create_cfunc_wrapper = lambda self: None
    context: Any = base.BaseContext
    nowhere = ir.IntType(64)(NO_ADDRESS).inttoptr(ir.IntType(8).as_pointer())
    context.add_dynamic_addr = lambda self, builder, address, info: nowhere
    flags: Any = fastmathpass.FastFloatBinOpVisitor
    # numba takes flags in the order of a set, which for a set of constants depends on who wrote the bytecode
    flags.__init__ = lambda self, given: setattr(self, "flags", sorted(given))
    names: Any = funcdesc
    names.default_mangler = lambda name, arguments, *, abi_tags=(), uid=None: (
        f"_ZN{name}.{uid}-{hashlib.sha256(repr((arguments, abi_tags)).encode()).hexdigest()[:16]}"
    )
    worker: Any = inline_closurecall.InlineWorker
    inline = worker.inline_ir

    def inline_numbered(self: Any, caller: Any, block: Any, i: int, callee: Any, *more: Any, **named: Any) -> Any:
        """Names variables and blocks of an inlined function by its turn in the caller, not in this process."""
        caller.turns = getattr(caller, "turns", 0) + 1
        callee.func_id.unique_name = f"{callee.func_id.func_qualname}${caller.turns}"
        label: Any = ir_utils._the_max_label  # numba uses at least the caller's
        label._value = 0
        return inline(self, caller, block, i, callee, *more, **named)

    worker.inline_ir = inline_numbered
    return definitions, declarations


def name_records_once() -> None:
    """Makes numba write the name of a record's type, which lists its fields, once: a tenth of its time."""
    from numba.core import types

    record: Any = types.Record
    named = record.__repr__
    record.__repr__ = lambda self: self.__dict__.get("_named") or self.__dict__.setdefault("_named", named(self))


def internal(text: str) -> str:
    """Makes a definition of a function or of data internal to its module; removes names inside a declaration."""
    if text.startswith("declare"):
        return re.sub(r' %"[^"]*"', "", text)
    text = re.sub(r"^define (linkonce_odr )?", "define internal ", text)
    return re.sub(r"^(@.+?) = (?:linkonce|common) (?=constant|global)", r"\1 = internal ", text)


def all_entries() -> dict[str, Entry]:
    """All entries, by name. Imports the files of the kernels."""
    for source in store.sources():
        module = source.relative_to(store.PACKAGE.parent).with_suffix("").as_posix().replace("/", ".")
        if not module.startswith("livebass.compiling"):
            importlib.import_module(module.removesuffix(".__init__"))
    return dict(sorted(ENTRIES.items()))


def gate(entry: Entry, raw: str) -> str:
    """The IR of the C function `lb_NAME`; it calls numba's function `raw`: result by address, errors by status."""
    result = LLVM_TYPES[entry.result]
    kinds = [LLVM_TYPES[kind] for kind in entry.arguments]
    given = "".join(f", {kind} %{i}" for i, kind in enumerate(kinds))
    held = "ptr" if result == "void" else result
    lines = [
        f"define {result} @lb_{entry.name}({given.lstrip(', ')}) {entry.attributes} {{",
        f"  %result = alloca {held}",
        "  %error = alloca ptr",
        f"  store {held} {ZEROS.get(held, '0')}, ptr %result",
        f'  %status = call i32 @"{raw}"(ptr %result, ptr %error{given})',
    ]
    if result == "void":
        return "\n".join([*lines, "  ret void", "}"])
    return "\n".join([*lines, f"  %value = load {result}, ptr %result", f"  ret {result} %value", "}"])


def shared_out(reaches: Mapping[str, Weights], parts: int) -> list[list[str]]:
    """Divides the entries among one or two processes: one takes the heaviest and those that add least to it.

    `reaches`: the functions of each entry. Both processes compile what both need. It keeps the longer share short.
    """
    if parts == 1:
        return [sorted(reaches)]

    def weight(names: Iterable[str]) -> int:
        together: Weights = {}
        for name in names:
            together |= reaches[name]
        return sum(together.values())

    heaviest = max(sorted(reaches), key=lambda name: weight([name]))
    rest = sorted(set(reaches) - {heaviest}, key=lambda name: (weight([heaviest, name]), name))
    cuts = [([heaviest, *rest[:at]], rest[at:]) for at in range(len(rest) + 1)]
    return [*min(cuts, key=lambda cut: max(map(weight, cut)))]


def reachable(function: Any) -> Weights:
    """`function`, all that it names in its package, and so on recursively; with the lengths of their code."""
    found: Weights = {}
    waiting, home = [function], function.__module__.split(".")[0]
    while waiting:
        one = waiting.pop()
        one = getattr(one, "py_func", getattr(one, "function", one))  # unwraps numba's or an entry
        if not isinstance(one, FunctionType) or one.__module__.split(".")[0] != home:
            continue
        name = f"{one.__module__}.{one.__qualname__}"
        if name not in found:
            codes = [one.__code__]
            for code in codes:
                codes += [inside for inside in code.co_consts if isinstance(inside, CodeType)]
            found[name] = sum(len(code.co_code) for code in codes)
            waiting += [used for code in codes for used in _referenced(one, code)]
    return found


def _referenced(function: FunctionType, code: CodeType) -> Iterator[Any]:
    """Yields the values that `code`, of `function`, names: from its module, enclosing function, and their modules."""
    cells = function.__closure__ or ()
    around = {name: cell.cell_contents for name, cell in zip(function.__code__.co_freevars, cells, strict=True)}
    for name in (*code.co_names, *code.co_freevars):
        value = around.get(name, function.__globals__.get(name))
        if isinstance(value, ModuleType):
            yield from (vars(value)[inside] for inside in code.co_names if inside in vars(value))
        elif isinstance(value, tuple):
            yield from value
        else:
            yield value


def main(part: str, parts: str) -> None:
    """Compiles the entries of one part."""

    def work(tell: processes.Progress) -> bytes:
        found = all_entries()
        reaches = {name: reachable(entry.function) for name, entry in found.items()}
        names = shared_out(reaches, int(parts))[int(part)]
        return json.dumps(compile_entries([found[name] for name in names], tell)).encode()

    processes.serve(work)


if __name__ == "__main__":
    main(*sys.argv[1:])
