"""The cache of compiled models that tests share."""

from tests.models.cache import shared_cache

__all__ = ["shared_cache"]
