"""Programs that stand in for others."""


def program(folder, name, text):
    """An executable file below a folder; returns its path."""
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path
