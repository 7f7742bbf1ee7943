"""The LV2 and VST3 plugins in Ardour, on tracks of a session that it saves, loads and exports."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from support.ardour import RATE, Ardour, is_export_of, needs_ardour, put_notes
from support.lv2 import Plugin
from support.plugins import mono

from livebass import load_preset, score_of
from livebass.live.parameters import PARAMETERS
from livebass.plugin import lv2, vst3
from livebass.plugin.systems import this_system
from livebass.rows.techniques import PARAMETER_ROWS, PICKED

pytestmark = pytest.mark.skipif(not this_system().name.startswith("linux"), reason="Ardour of Debian")
BASSES = ("jazz-finger", "slap")
NOTES = [(0.25 * k, 0.4, 28 + 5 * (k % 4) + k // 4, 127 - 8 * k) for k in range(8)]
SECONDS = 3
MOVED = {"tone": -0.5, "action": 0.5, "technique": float(PICKED), "palm_mute": 0.5, "legato": 1.0}
VST3_ID = "6C697665626173739D3F0C5100000001"
NO_PROGRAM = {"bass", "cores"}  # parameters that VST3 hosts show as programs, or hide
# A hard-panned track comes out of one side of the master bus at this gain instead of 1
PANNED = np.nextafter(np.float32(1), np.float32(0))
MAKE = f"""
local moved = {{{", ".join(f'["{PARAMETER_ROWS[symbol].name}"] = {value}' for symbol, value in MOVED.items())}}}
"""
MAKE += """
-- Ardour connects tracks, loads presets and sets parameters in threads of its own: what is saved too soon lacks them
local function wait_for(what, ready)
  for _ = 1, 600 do
    if ready() then return end
    sleep(0.1)
  end
  error("Ardour does not " .. what)
end
local function play(frames)
  local last = AudioEngine:processed_samples() + frames
  wait_for("play", function() return AudioEngine:processed_samples() >= last end)
end
local function tell(...)
  local words = {"TOLD", ...}
  for k, word in ipairs(words) do words[k] = tostring(word) end
  print(table.concat(words, "|"))
end
AudioEngine:set_backend("None (Dummy)", "", "")
AudioEngine:set_buffer_size(1024)
local session = create_session(arg[1], "plain", 48000)
for plugin in ARDOUR.LuaAPI.list_plugins():iter() do
  if plugin.name:find("livebass") then
    tell("plugin", ARDOUR.PluginType.name(plugin.type, true), plugin.name, plugin:is_instrument())
  end
end
local sound = ARDOUR.ChanCount(ARDOUR.DataType("audio"), 1)
local notes = ARDOUR.ChanCount(ARDOUR.DataType("midi"), 1)
local inserted = {}
for k, kind in ipairs({"LV2", "VST3"}) do
  local info = ARDOUR.LuaAPI.new_plugin_info(arg[k + 1], ARDOUR.PluginType[kind])
  assert(not info:isnil(), kind)
  local track = session:new_midi_track(notes, sound, true, info, nil, nil, 1, kind,
                                       ARDOUR.PresentationInfo.max_order, ARDOUR.TrackMode.Normal, true):front()
  track:pan_azimuth_control():set_value(k - 1, PBD.GroupControlDisposition.NoGroup)
  inserted[k] = track:nth_plugin(0):to_insert()
  for side = 0, 1 do
    wait_for("connect tracks", function() return track:output():audio(side):connected() end)
  end
end
session:save_state("")
for k, kind in ipairs({"LV2", "VST3"}) do
  local plugin = inserted[k]:plugin(0)
  local preset = plugin:preset_by_label("Slap")
  tell("preset", kind, preset.valid, plugin:load_preset(preset))
  play(48000)
  local input = 0
  for i = 0, plugin:parameter_count() - 1 do
    if plugin:parameter_is_control(i) then
      local name = plugin:parameter_label(i)
      tell(kind, name, plugin:parameter_is_input(i))
      if moved[name] then ARDOUR.LuaAPI.set_plugin_insert_param(inserted[k], input, moved[name]) end
      input = input + 1
    end
  end
end
play(48000)
session:save_state("moved")
close_session()
"""
AGAIN = """
AudioEngine:set_backend("None (Dummy)", "", "")
AudioEngine:set_buffer_size(256)
local session = load_session(arg[1], "moved")
session:save_state("")
close_session()
"""


def test_a_session_sounds_as_livebass_renders_before_and_after_it_was_saved(tmp_path: Path) -> None:
    needs_ardour()
    basses = {name: load_preset(name) for name in BASSES}
    lv2.write_bundle(basses, bundle := tmp_path / ".lv2" / "livebass.lv2")
    vst3.write_bundle(basses, tmp_path / ".vst3" / "livebass.vst3")
    ardour, session = Ardour(tmp_path), tmp_path / "song"
    assert "Found Plugin: livebass strings" in ardour.scan(tmp_path / ".vst3" / "livebass.vst3")

    reported = ardour.make(session, MAKE, lv2.URI, VST3_ID)
    assert sorted(row[1:] for row in reported if row[0] == "plugin") == [
        [kind, name, "true"] for kind in ("LV2", "VST3") for name in ("livebass", "livebass strings")
    ]
    assert [row[1:] for row in reported if row[0] == "preset"] == [[kind, "true", "true"] for kind in ("LV2", "VST3")]
    names = [p.name for p in PARAMETERS]
    automatic = [p.name for p in PARAMETERS if p.symbol not in NO_PROGRAM]
    for kind, inputs in (("LV2", [*names, "Freewheeling"]), ("VST3", automatic)):
        found = [row[1:] for row in reported if row[0] == kind]
        assert found == [*([name, "true"] for name in inputs), ["Overload", "false"]]

    for snapshot in ("plain", "moved"):
        put_notes(session, snapshot, NOTES, SECONDS)
    score = score_of(NOTES, RATE)
    wanted = mono("jazz-finger", score)[: SECONDS * RATE] * PANNED
    plain = ardour.export(session, "plain")
    assert plain.shape[1] == SECONDS * RATE and np.abs(wanted).max() > 0.2
    assert is_export_of(plain, wanted)

    with closing(Plugin(bundle)) as host:
        host.controls["bass"].value = 1
        for symbol, value in MOVED.items():
            host.controls[symbol].value = value
        for _ in range(3):  # the initial bass must have begun
            host.block(64)
            host.work()
        host.block(RATE)
        wanted = host.play(score, SECONDS * RATE) * PANNED
    assert is_export_of(ardour.export(session, "moved"), wanted)
    before = (session / "moved.ardour").stat().st_mtime_ns
    ardour.lua(AGAIN, session)
    assert (session / "moved.ardour").stat().st_mtime_ns > before
    assert is_export_of(ardour.export(session, "moved"), wanted)
