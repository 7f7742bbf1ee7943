"""Tables, CSV, JSON, pictures and HTML pages: how every room writes its results."""
