"""The sections of the page, one module each; each module has one function that makes its section."""
