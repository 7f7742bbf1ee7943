"""The linker of the page's module, tested by running small LLVM programs that it has linked."""

from __future__ import annotations

import pytest

from livebass.web import linking

wasmtime = pytest.importorskip("wasmtime")
STACK = 1 << 16
# Names data and functions in every way possible in an object file; `unused` and its own callees are unreachable.
PROGRAM = """
target triple = "wasm32-unknown-unknown"
target datalayout = "e-m:e-p:32:32-p10:8:8-p20:8:8-i64:64-i128:128-n32:64-S128-ni:1:10:20"
@odd = private constant [3 x i8] c"abc"
@rows = private constant [2 x i32] [i32 17, i32 25], align 16
@places = private constant [2 x ptr] [ptr @rows, ptr getelementptr (i8, ptr @rows, i32 4)]

define i32 @row(i32 %k) {
  %at = getelementptr [2 x ptr], ptr @places, i32 0, i32 %k
  %place = load ptr, ptr %at
  %found = load i32, ptr %place
  ret i32 %found
}
define i32 @letter(i32 %k) {
  %at = getelementptr [3 x i8], ptr @odd, i32 0, i32 %k
  %found = load volatile i8, ptr %at
  %wide = zext i8 %found to i32
  ret i32 %wide
}
define i32 @on_the_stack(i32 %k) noinline {
  %room = alloca [64 x i32]
  %at = getelementptr [64 x i32], ptr %room, i32 0, i32 %k
  store volatile i32 %k, ptr %at
  %found = load volatile i32, ptr %at
  %place = ptrtoint ptr %at to i32
  %sum = add i32 %found, %place
  ret i32 %sum
}
define i32 @both(i32 %k) {
  %a = call i32 @row(i32 %k)
  %b = call i32 @on_the_stack(i32 %k)
  %sum = add i32 %a, %b
  ret i32 %sum
}
define i32 @through(ptr %function, i32 %k) {
  %found = call i32 %function(i32 %k)
  ret i32 %found
}
define internal i32 @only_of_unused(i32 %k) noinline {
  %found = call i32 @row(i32 %k)
  ret i32 %found
}
define i32 @unused(i32 %k) {
  %found = call i32 @only_of_unused(i32 %k)
  ret i32 %found
}
"""


def compile_text(text: str = PROGRAM) -> bytes:
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple("wasm32-unknown-unknown").create_target_machine(reloc="static")
    return bytes(machine.emit_object(llvm.parse_assembly(text)))


def test_functions_find_their_data_their_stack_and_each_other() -> None:
    module = linking.link(compile_text(), ["both", "through", "letter", "row"], STACK)
    store = wasmtime.Store()
    made = wasmtime.Module(store.engine, module)
    assert not list(made.imports)
    x = wasmtime.Instance(store, made, []).exports(store)
    assert [x["row"](store, k) for k in (0, 1)] == [17, 25]
    assert bytes(x["letter"](store, k) for k in range(3)) == b"abc"
    assert x["both"](store, 1) - (25 + 1 + 4) in range(STACK), "its room is on the stack"
    table = x["__indirect_function_table"]
    assert x["through"](store, table.grow(store, 1, x["row"]), 1) == 25
    heap = x["__heap_base"].value(store)
    assert heap % 16 == 0 and STACK < heap <= x["memory"].data_len(store)
    assert bytes(x["memory"].read(store, STACK, STACK + 3)) == b"abc", "data lie behind the stack"


def test_what_no_export_reaches_is_left_out() -> None:
    sizes = [len(linking.link(compile_text(), names, STACK)) for names in (["both"], ["both", "unused"])]
    assert sizes[0] < sizes[1]


@pytest.mark.parametrize(
    "data, why",
    [
        (lambda: b"ELF", "no WebAssembly"),
        (compile_text, "there is no function gone"),
        (
            lambda: compile_text("declare void @other()\ndefine void @gone() { call void @other() ret void }"),
            "needs other",
        ),
        (lambda: compile_text("define void @f() { ret void } define ptr @gone() { ret ptr @f }"), "relocation of kind"),
    ],
    ids=["no-wasm", "no-such", "not-alone", "address"],
)
def test_what_it_cannot_link_is_one_line(data: object, why: str) -> None:
    with pytest.raises(linking.LinkError, match=why):
        linking.link(data(), ["gone"], STACK)  # type: ignore[operator]
