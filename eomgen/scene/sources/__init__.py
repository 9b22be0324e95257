"""Where descriptions come from: TOML with included files, XML, URDF."""
