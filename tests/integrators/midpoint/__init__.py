"""An implicit family of integration methods as another distribution would bring it: a module and its templates."""
