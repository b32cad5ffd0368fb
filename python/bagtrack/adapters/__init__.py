"""The tracker in other tools. Each module needs the extra of its name, like bagtrack[got10k]."""
