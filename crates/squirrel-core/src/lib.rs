//! squirrel-core.
