int placeholder_laws_menu;
