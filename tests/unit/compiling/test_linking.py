"""Kernels linked into an image: calls, tables of addresses, the C library's memory functions; without LLVM."""

from __future__ import annotations

import ctypes
import sys

import pytest
from support.command import python_output

from livebass.compiling import emitter, library, linking, store

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not store.level().startswith("x86-64"), reason="other systems load the object file"
)

# A table of functions, a call through it, and a copy that is too long for anything but memcpy
PROGRAM = """
@table = internal constant [2 x ptr] [ptr @twice, ptr @less]
define i64 @twice(i64 %x) noinline {
  %y = mul i64 %x, 2
  ret i64 %y
}
define i64 @less(i64 %x) noinline {
  %y = sub i64 %x, 1
  ret i64 %y
}
define i64 @lb_choose(i64 %which, i64 %x) {
  %at = getelementptr [2 x ptr], ptr @table, i64 0, i64 %which
  %f = load ptr, ptr %at
  %y = call i64 %f(i64 %x)
  ret i64 %y
}
define void @lb_copy(ptr %to, ptr %from, i64 %count) {
  call void @llvm.memcpy.p0.p0.i64(ptr %to, ptr %from, i64 %count, i1 false)
  ret void
}
define double @lb_third(double %x) {
  %y = fdiv double %x, 3.0
  ret double %y
}
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
"""


@pytest.fixture(scope="module")
def compiled() -> bytes:
    return emitter.emit(PROGRAM, store.level())[0]


@pytest.mark.parametrize("link", [True, False])
def test_an_image_does_what_the_object_file_does(compiled: bytes, link: bool) -> None:
    image = linking.link(compiled)
    assert linking.is_image(image) and not linking.is_image(compiled)
    address = linking.load_image(image) if link else library.object_file(compiled)
    choose = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)(address("choose"))
    assert [choose(0, 21), choose(1, 21)] == [42, 20]
    third = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(address("third"))
    assert third(7.0) == 7.0 / 3.0
    copy = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int64)(address("copy"))
    to, given = ctypes.create_string_buffer(100_000), bytes(range(250)) * 400
    copy(to, given, len(given))
    assert to.raw == given
    with pytest.raises(KeyError):
        address("unknown")


def test_unknown_files_stay_as_they_are(compiled: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """LLVM links those of other systems, with a call of another function, or with a relocation of another type."""
    of_arm = bytearray(compiled)
    of_arm[18:20] = (183).to_bytes(2, "little")
    machine, module = emitter.parse_ir(PROGRAM.replace("llvm.memcpy.p0.p0.i64", "strange"), store.level())
    for data in (b"\0asm", bytes(of_arm), machine.emit_object(module)):
        assert data == linking.link(data)
    monkeypatch.setattr(linking, "CALL", -1)
    assert compiled == linking.link(compiled)


def test_loading_kept_kernels_needs_no_llvm() -> None:
    library.library()
    if not library.is_cached():
        pytest.skip("no directory keeps kernels here")
    code = "import sys; from livebass.compiling.library import library; library()('process');"
    code += "print(sorted({'numba', 'llvmlite'} & set(sys.modules)))"
    assert python_output("-c", code) == "[]\n"
