"""The compiled files of the package mild for NVIDIA's GPUs. There is nothing here to import: mild takes them where there is a GPU."""
