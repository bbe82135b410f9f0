"""Programs that run plugins beside other systems than tussle's simulation."""
