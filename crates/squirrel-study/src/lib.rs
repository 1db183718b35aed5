//! squirrel-study.
