"""The window. Its files import imgui-bundle and moderngl; nothing else does, and nothing imports them but `play`."""
