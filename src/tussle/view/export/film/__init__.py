"""Films and pictures of recorded runs."""

from tussle.view.export.film.film import FilmReport, write_film
from tussle.view.export.film.options import FilmOptions

__all__ = ["FilmOptions", "FilmReport", "write_film"]
