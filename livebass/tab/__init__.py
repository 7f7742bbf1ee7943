"""Reads tablature (Guitar Pro, MusicXML) and plays it on the strings and frets where it is written."""
