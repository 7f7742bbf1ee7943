"""Turns recorded notes of one bass into a preset: `fit.fit` does what `livebass fit` does.

`notes` reads them, `plan` chooses which are fitted and which judge, `estimates` takes what can be read off directly,
`search` finds the rest within `bounds` by the score of `target`, `judge` compares, `written` and `page` tell.
"""
