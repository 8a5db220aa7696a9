//! The command as users meet it: exit codes, messages, files.

mod compare;
mod page;
mod support;
