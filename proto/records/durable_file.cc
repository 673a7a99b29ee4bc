// written with its folder
