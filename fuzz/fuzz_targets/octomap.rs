#![no_main]
portolan_fuzz::target!("octomap", portolan_fuzz::readers::octomap);
