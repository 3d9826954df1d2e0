"""From a measured road to heights on a grid: files of many instruments, what is done to them, what they are like."""
