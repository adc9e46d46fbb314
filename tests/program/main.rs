//! The program as its users meet it: arguments in, folders, text and exit codes out.

mod ablate;
mod bad_input;
mod baselines;
mod dataset;
mod face;
mod fakes;
mod hair_file;
mod job;
mod judge;
mod layering;
mod outside;
mod pipe;
mod rest;
mod sequence;
mod stop;
mod support;
mod tables;
mod workflow;
