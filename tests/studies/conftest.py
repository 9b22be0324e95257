"""The cache of compiled models that the runtime's tests use."""

from tests.runtime.conftest import shared_cache

__all__ = ["shared_cache"]
