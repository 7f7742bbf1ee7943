"""The page's modules joined into one script: in order, without circles, each with its imports."""

from __future__ import annotations

import json
import re
import subprocess

import pytest
from support.needs import tool

from livebass.web.modules import STATIC, join_modules
from livebass.web.public import PUBLIC

ENTRIES = ("main.js", "worker.js", "worklet.js")


def value(script: str) -> object:
    """The value of a joined script, in node."""
    tool("node")
    given = f"process.stdout.write(JSON.stringify({script.rstrip().removesuffix(';')}))"
    return json.loads(subprocess.run(["node", "-e", given], capture_output=True, text=True, check=True).stdout)


def test_each_module_has_names_of_its_own_and_runs_once_behind_what_it_imports() -> None:
    modules = {
        "one.js": 'import {add, said} from "./two.js";\nimport * as all from "./two.js";\nimport "./three.js";\n'
        "const own = 1;\nadd(own);\nexport const found = [said, all.said === said];\n",
        "two.js": "const own = 2;\nexport const said = [own];\nexport function add(x) { said.push(x); }\n",
        "three.js": 'import {add} from "./two.js";\nclass Own {}\nadd(3);\nexport class Other extends Own {}\n',
    }
    assert value(join_modules("one.js", modules)) == {"found": [[2, 3, 1], True]}


@pytest.mark.parametrize(
    ("modules", "says"),
    [
        ({"a.js": 'import "./b.js";\n', "b.js": 'import "./a.js";\n'}, "circle: a.js -> b.js -> a.js"),
        ({"a.js": 'import {x} from "./b.js";\n', "b.js": "const x = 1;\n"}, "a.js: b.js exports no x"),
        ({"a.js": "export let x = 1;\n"}, "a.js: cannot be joined: export let x = 1;"),
        ({"a.js": "export default 1;\n"}, "a.js: cannot be joined: export default 1;"),
        ({"a.js": 'import x from "./b.js";\n'}, 'a.js: cannot be joined: import x from "./b.js";'),
    ],
)
def test_what_cannot_be_joined_is_refused(modules: dict[str, str], says: str) -> None:
    with pytest.raises(ValueError, match=re.escape(says)):
        join_modules("a.js", modules)


def test_no_module_is_left_out() -> None:
    """Each file of the page is in one of its scripts; the audio thread and the worker share files where they can."""
    scripts = {entry: join_modules(entry) for entry in ENTRIES}
    files = list(STATIC.rglob("*.js"))
    assert len({file.name for file in files}) == len(files) > 40
    for file in files:
        if file.name in (*PUBLIC, "first.js"):  # scripts of their own
            continue
        assert any(f"const ${file.stem} = " in script for script in scripts.values()), file.name
    assert "const $engine = " in scripts["worker.js"] and "const $engine = " in scripts["worklet.js"]
    assert "document" not in scripts["worker.js"] + scripts["worklet.js"]
