mod read_back;
mod samples;
