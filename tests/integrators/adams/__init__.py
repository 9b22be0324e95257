"""A family of integration methods as another distribution would bring it: a module and a folder of templates."""
