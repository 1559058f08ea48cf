"""Vectors: on the host they are of NumPy or of Quadrants."""

from typing import Any, TypeAlias

vec2: TypeAlias = Any
vec3: TypeAlias = Any
vec4: TypeAlias = Any
mat3: TypeAlias = Any

def __getattr__(name: str) -> Any: ...
