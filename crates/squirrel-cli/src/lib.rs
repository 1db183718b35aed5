//! squirrel-cli.
