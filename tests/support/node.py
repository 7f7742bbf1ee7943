"""The page's JavaScript without a browser: modules run in node, with the kernels as WebAssembly."""

from __future__ import annotations

import base64
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from livebass.web import build
from livebass.web.modules import joined
from support.needs import tool

RUN = """
const given = JSON.parse(require("node:fs").readFileSync(0, "utf8"));
const module_ = new WebAssembly.Module(Buffer.from(given.module, "base64"));
process.stdout.write(JSON.stringify(made.run(() => new WebAssembly.Instance(module_), ...given.arguments)));
"""


def run(source: str, *arguments: Any) -> Any:
    """What `run` of the module `source` returns for a function that makes an instance of the kernels, and `arguments`.

    The module may import the page's modules. Arguments and result are JSON. Skips the test without node.
    """
    node = tool("node")
    given = {"module": base64.b64encode(build.module()).decode(), "arguments": arguments}
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "run.js"
        script.write_text(f"const made = {joined('test.js', {'test.js': source})}{RUN}")
        done = subprocess.run([node, script], input=json.dumps(given), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)
