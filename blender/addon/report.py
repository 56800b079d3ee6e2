"""What of a scene is not rendered as Blender has it."""


class Report:
    """Warnings, each once, in the order in which they came up."""

    def __init__(self):
        self._lines = {}

    def warn(self, owner, message):
        """Notes that something of a data block or node is left out or approximated.

        owner: what the message is about, such as a material or a light.
        """
        self._lines[f"{owner}: {message}"] = None

    @property
    def lines(self):
        """All warnings."""
        return list(self._lines)
