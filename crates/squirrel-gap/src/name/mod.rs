mod evidence;
mod linear;
mod parameters;
mod search;
mod whiten;
