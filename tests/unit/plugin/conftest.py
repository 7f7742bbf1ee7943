from support.plugins import no_instruments_of_the_user  # noqa: F401
