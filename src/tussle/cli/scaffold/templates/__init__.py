"""Templates of `tussle new`: one working plugin, named New, per kind."""
