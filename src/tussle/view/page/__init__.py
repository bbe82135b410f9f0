"""The page in the browser on which a game is watched and steered."""
