// The module that livebass/web/rule.py makes: how MIDI files are read.
export const RULE: Record<string, any>;
