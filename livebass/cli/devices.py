"""`livebass devices`: lists the devices that `play` can use."""

from __future__ import annotations

import click

from livebass.rows.units import one_line


@click.command()
def devices() -> None:
    """List audio outputs and MIDI inputs.

    `play` takes their numbers, or parts of their names.
    """
    from livebass.live.device_errors import MidiLost, OutputLost
    from livebass.live.guards import own_stderr
    from livebass.live.jack import jack_server
    from livebass.live.midi import port_names
    from livebass.live.portaudio import output_names

    with own_stderr():  # keep messages of C libraries out of the list
        click.echo(f"JACK server (--backend jack)\n  {jack_server() or 'none'}")
        for title, names, lost in (
            ("audio outputs of PortAudio (--audio)", output_names, OutputLost),
            ("MIDI inputs (--midi)", port_names, MidiLost),
        ):
            click.echo(title)
            try:
                lines = names()
            except lost as error:
                click.echo(f"  none: {one_line(str(error))}")
                continue
            for number, name in lines.items() if isinstance(lines, dict) else enumerate(lines):
                click.echo(f"  {number}  {one_line(name)}")
            if not lines:
                click.echo("  none")
