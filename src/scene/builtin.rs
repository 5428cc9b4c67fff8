//! Built-in scenes, made by the program itself.
